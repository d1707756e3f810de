"""The task: its MDP, its diagram, and episodes of it."""

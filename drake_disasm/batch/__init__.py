"""The twin in batches: many episodes in lockstep, by the same equations."""

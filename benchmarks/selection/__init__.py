"""The judge of effect selection: cases, selectors and scores.

answer              a case, an answer, and what a selector is
cases               the list of cases, written to a folder when asked for
simulated, readings, cell, real     where the logs of cases come from
hidden, noise       effects of a size, and noise
scores              what an answer is worth
judge, ablation     the programs
columns             derivatives by all candidates, for simple selectors
sketch, bic, group_lasso, frozen, current       selectors
"""

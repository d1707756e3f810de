"""What a fit leaves: its size, whether it is noise, and what could be learned of it.

held_out                            errors on rows that were not fitted
whiteness, channel_checks           correlation, excess, lines, outlying rows
predictable_residual, residual_model  what a flexible learner finds, and its model
command_scatter                     scatter about commands, an effect on variances
residual_diagnosis                  numbers of each channel, for reports
"""

"""Effects between where the arm is and what is reported of it."""

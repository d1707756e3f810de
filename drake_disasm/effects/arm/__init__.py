"""Effects at an arm's joints."""

"""What all other packages use: errors, files, progress, work in parallel, resuming."""

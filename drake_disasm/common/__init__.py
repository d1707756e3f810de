"""What every other package uses: errors, files, quantities, work in parallel."""

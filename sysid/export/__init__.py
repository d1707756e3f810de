"""What closing the loop identified, written back into robot descriptions."""

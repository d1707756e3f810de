"""Effects in the world around the bolt."""

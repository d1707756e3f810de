"""Effects between the pose that is commanded and the one that the arm goes for."""

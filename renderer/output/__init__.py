"""Films and image files."""

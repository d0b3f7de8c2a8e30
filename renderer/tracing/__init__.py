"""How light gets from place to place quickly."""

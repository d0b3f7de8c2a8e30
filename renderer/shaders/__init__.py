"""How each object's light is found."""

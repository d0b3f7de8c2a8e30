"""Scene, objects, camera and lights: what is there."""

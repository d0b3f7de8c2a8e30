"""Scenes for other renderers."""

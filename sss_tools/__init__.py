"""Is this mesh fit for subsurface scattering, and can it be made so?"""

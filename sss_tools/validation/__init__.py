"""The rules: what can be wrong with a mesh, where it is, and what it does to the light.

Every other module here but ``rule`` and ``run`` is a family of rules and is found by listing this folder.
"""

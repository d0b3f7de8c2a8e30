"""What a check found, as text: in full, one line a finding, JSON, SARIF, GitHub's workflow commands.

Each module writes in pieces (``chunks``), so that a report on many meshes need not be held in memory.
"""

"""What a check found, as text: in full, one line a finding, or JSON."""

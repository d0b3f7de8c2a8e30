"""Arguments in, one call, exit status out."""

"""What is there, and what is wrong with it, to look at: stills, a page, a window."""

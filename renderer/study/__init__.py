"""Studies: how right and how fast pictures are. Above everything that renders; nothing that renders imports it."""

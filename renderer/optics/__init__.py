"""What light does at surfaces and in media, as pure functions of arrays."""

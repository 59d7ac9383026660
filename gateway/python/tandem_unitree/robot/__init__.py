"""One simulated G1: its commands, senses, messages and clock."""

"""One simulated G1: what it is told, what it senses, what it publishes, and when its time passes."""

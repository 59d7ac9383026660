"""What goes to episodes and what comes back, as classes. All other modules here are written from the one list of tools."""

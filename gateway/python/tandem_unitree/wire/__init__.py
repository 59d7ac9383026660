"""Formats of Unitree's messages: order of joints, layouts of bytes, checksums and calls."""

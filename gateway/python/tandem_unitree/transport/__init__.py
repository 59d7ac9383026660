"""DDS topics and ZMQ sockets."""

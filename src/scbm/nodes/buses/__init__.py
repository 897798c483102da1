"""Message buses behind one interface: in-process loopback, Cyclone DDS, rclpy."""

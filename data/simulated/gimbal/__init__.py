"""The yaw axis of a gimbal, simulated."""

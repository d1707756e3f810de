"""Effects in the chain of the force/torque sensor."""

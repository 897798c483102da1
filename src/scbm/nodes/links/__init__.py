"""Links from a controller to the drivers of resources: topic pairs, services, measured topics."""

"""The `ros` key of a resource and binding files: services, topics and the data that they carry."""

"""The operator's page: a robot's state as frames of JSON, served to browsers and terminals."""

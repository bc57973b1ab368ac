"""Sensors whose samples are old when they are used: the plant with the samples that are under way."""

"""Certificates for nonuniform sampling."""

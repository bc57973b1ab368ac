"""Statements on nonuniform sampling."""

"""x"""
CHECKS: dict = {}

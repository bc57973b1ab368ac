"""x"""

CHECKS: dict = {}

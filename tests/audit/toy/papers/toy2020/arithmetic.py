"""What `square` uses and nothing else does."""


def product(left: float, right: float) -> float:
    return left * right

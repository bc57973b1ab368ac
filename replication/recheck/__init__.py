"""The second verifier: the same certificates by other code, with the standard library alone.

Written from the statements and from docs/certificates.md. It imports nothing of the first one, and nothing else.
"""

"""The verifier of certificates: exact and ball arithmetic; imports the standard library and python-flint, nothing else.

It shares no code with what makes certificates, so that it can be read, and trusted, by itself.
"""

"""Both verifiers say the same of every altered certificate, and so does no small change of either, unless it changes
no answer.
"""

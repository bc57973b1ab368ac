"""The audit of papers: what they print, what comes out, and how the two compare. Knows no control theory.

model: the words. store: what is written and read back. judge: from a print and its evidence to a verdict.
run: from papers to results. inspect: results looked at again. report: the page. publish: all else that is written.
"""

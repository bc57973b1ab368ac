"""The opening of the report: the answer, a picture of all claims, how a verdict is reached, the papers in brief."""

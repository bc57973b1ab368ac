"""The opening of the report: the answer in a sentence, a picture of all claims, how a verdict is reached, the papers."""

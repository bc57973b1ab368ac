"""The theory: plants, designs, norms. Knows no paper, no file and no plot."""

"""What is computed for Peet and Gu (2019): functions of JSON values that return JSON values."""

"""From papers to a results file: tasks in processes, claims answered, certificates made and verified, figures drawn."""

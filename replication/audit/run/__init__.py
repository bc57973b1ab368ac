"""Running an audit: tasks in processes, certificates, figures, and the assembly of the results."""

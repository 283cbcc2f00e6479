"""What the service keeps across restarts: logs, versions of models, jobs; files and a database."""

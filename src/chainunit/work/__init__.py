"""Long work: jobs, their runner and store, progress and interrupts."""

"""Studies of single questions: other routes to results, tables of pages, and tests that take long."""

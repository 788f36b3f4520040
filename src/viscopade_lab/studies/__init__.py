"""Studies of single questions: the cost of a route, and the result of another one."""

"""Machine code, the threads that run it and the memory that it reads: what knows no kernel."""

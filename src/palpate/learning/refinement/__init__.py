"""How many units a network needs: growth and pruning around the refinement."""

"""palpate: turn a nonlinear finite-element model into something you can touch."""

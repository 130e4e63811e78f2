"""In the hand: a real-time process that reads a device, evaluates the learnt body and sends a force back."""

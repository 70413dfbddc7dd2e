"""What a diagnosis says: the types of its result, which every kind of study fills; nothing is worked out here."""

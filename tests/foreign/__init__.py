"""Truth made by others: generators that were written from the contract alone."""

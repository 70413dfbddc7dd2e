"""Tables, page and figures of a compensation."""

"""From measured tests to numbers of a scene: tables of data, predictions with derivatives, least squares, and what data determine."""

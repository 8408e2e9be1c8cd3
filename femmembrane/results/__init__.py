"""What a computation leaves behind: records in memory, tables and files on disk."""

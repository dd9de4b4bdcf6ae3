"""Import of measurements that other programs wrote."""

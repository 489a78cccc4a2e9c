"""Figures of the demonstration's page that no verb of the library draws."""

"""Designs of a campaign (which strikes to run), their quality, and the campaign that runs them."""

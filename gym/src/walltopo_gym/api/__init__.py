"""HTTP: `/api/v1`, whose OpenAPI document is the contract. Nothing is decided here that is not
about HTTP or about who may ask."""

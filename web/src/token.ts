// The token that says who looks: from the address that `vantage` printed (#token=…), or typed in; kept for this tab only.
const key = 'vantage-token';

/// Takes the token out of the address, so that it is neither bookmarked nor shared.
export function takeTokenFromAddress() {
  const query = new URLSearchParams(location.hash.slice(1));
  const token = query.get('token');
  if (!token) return;
  sessionStorage.setItem(key, token);
  query.delete('token');
  const rest = query.toString();
  history.replaceState(null, '', location.pathname + (rest && '#' + rest));
}

export const hasToken = () => sessionStorage.getItem(key) !== null;
export const setToken = (token: string) => token ? sessionStorage.setItem(key, token) : sessionStorage.removeItem(key);

export function authorization(): Record<string, string> {
  const token = sessionStorage.getItem(key);
  return token ? {Authorization: 'Bearer ' + token} : {};
}

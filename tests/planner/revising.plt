:- use_module(library(plunit)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(planning)).
:- use_module(planner_golog(steps)).

% Each box is searched for where it stands, by whichever robot; two boxes, three places.

store :-
    load_facts(
        [ kind(v, r1, 'Robot'), kind(v, r2, 'Robot'), kind(v, b1, 'Box'), kind(v, b2, 'Box'), kind(v, b3, 'Box'),
          kind(v, p1, 'Place'), kind(v, p2, 'Place'), kind(v, p3, 'Place'),
          fluent(v, stands, b1, p1), fluent(v, stands, b2, p2),
          agent(v, 'Search'(R1, _), R1), keeps_robot(v, 'Search'),
          definition(v, 'Search'(R2, X2), F2, [call(F2, go, 'Go'(R2, X2)), call(F2, look, 'Look'(R2))]),
          agent(v, 'Go'(R3, _), R3), duration(v, 'Go'(_, _), fixed(10)), effect(v, 'Go'(R4, X4), fluent(locatedAt, R4), X4),
          agent(v, 'Look'(R5), R5), duration(v, 'Look'(_), fixed(5)),
          duration(v, 'Count', fixed(7)),
          definition(v, 'All', F6, [foreach(F6, each, [B-'Box', X-'Place'], holds(stands, B, X), I,
                                            pick(I, who, R6, 'Robot', call(I, search, 'Search'(R6, X)))),
                                    call(F6, count, 'Count')])
        ], _).

store_gone :- drop_facts(v, _).

% The session K, with a plan, under way.
under_way(K) :- open_session(request(K, v, 'All', 2, 0), _), planned(K, 0), next_actions(next(K, 0), _).
planned(K, Now) :- look_ahead(ahead(K, Now, tables([], [], [])), _), search_plan(search(K, 5000, -1), _).
planned(K, Now, Makespan) :- look_ahead(ahead(K, Now, tables([], [], [])), _), search_plan(search(K, 5000, -1), D), Makespan = D.makespan.
shown(Dict, Kinds, Shown) :-
    findall(Kind-Id, ( member([Kind, Id|_], Dict.events), memberchk(Kind, Kinds) ), Shown0), sort(Shown0, Shown).
changed(K, Now, Box, Place, Dict) :- observe(changed(K, Now, stands, Box, Place), Dict).
goal(Dict, Id, Place) :- member([started, Id, _, 'Go', _, Place], Dict.events), !.
id(K, Name, Id) :- atomic_list_concat([K, task, each, Name], /, Id).

:- begin_tests(revised, [setup(store), cleanup(store_gone)]).

test('an object that moves while it is gone for is gone for anew', Abandoned-Replan-Place == [abandoned-Go]-true-p3) :-
    under_way(m1), changed(m1, 3, b1, p3, Dict), shown(Dict, [abandoned, started], Abandoned), Replan = Dict.replan,
    planned(m1, 3), next_actions(next(m1, 3), Next), id(m1, 'b1/search/go', Go), goal(Next, Go, Place).
test('until there is a plan for it, nothing is chosen', Started == []) :-
    under_way(m2), changed(m2, 3, b1, p3, _), next_actions(next(m2, 4), Next), shown(Next, [started], Started).
test('the others go on', Running == 1) :- under_way(m3), changed(m3, 3, b1, p3, Dict), Running = Dict.running.
test('an object that goes is not gone for any more', Abandoned-M == [abandoned-Go]-14) :-
    under_way(m4), changed(m4, 3, b2, nowhere, Dict), shown(Dict, [abandoned], Abandoned), id(m4, 'b2/search/go', Go),
    planned(m4, 8, M).
test('a new one is', Started == [started-Go]) :-
    under_way(m5), changed(m5, 3, b3, p3, Dict), shown(Dict, [abandoned], []), get_dict(replan, Dict, true),
    planned(m5, 3), report(done(m5, 10, 'm5/task/each/b1/search/go', []), _),
    report(done(m5, 10, 'm5/task/each/b2/search/go', []), _), next_actions(next(m5, 10), _),
    report(done(m5, 15, 'm5/task/each/b1/search/look', []), A), report(done(m5, 15, 'm5/task/each/b2/search/look', []), B),
    shown(A, [started], As), shown(B, [started], Bs), append(As, Bs, Started), id(m5, 'b3/search/go', Go).
test('what is done stays done', Started-M == []-12) :-
    under_way(m6), report(done(m6, 10, 'm6/task/each/b1/search/go', []), _), report(done(m6, 15, 'm6/task/each/b1/search/look', []), _),
    changed(m6, 15, b2, p2, Same), get_dict(replan, Same, false), shown(Same, [started, abandoned], Started),
    report(done(m6, 16, 'm6/task/each/b2/search/go', []), _), planned(m6, 16, M).
test('a change to what nothing asks for changes nothing', Events-Replan == []-false) :-
    under_way(m7), observe(changed(m7, 3, color, b1, red), Dict), Events = Dict.events, Replan = Dict.replan.
test('before the for-each is come to, it is for what is there then', Ids == [started-G3]) :-
    open_session(request(m8, v, 'All', 2, 0), _), changed(m8, 0, b1, nowhere, _), changed(m8, 0, b2, nowhere, _), changed(m8, 0, b3, p1, _),
    planned(m8, 0), next_actions(next(m8, 0), Dict), shown(Dict, [started], Ids), id(m8, 'b3/search/go', G3).
test('an object that moves after its turn is done has another', Started == [started-Go]) :-
    under_way(m9), report(done(m9, 10, 'm9/task/each/b1/search/go', []), _), report(done(m9, 15, 'm9/task/each/b1/search/look', []), _),
    changed(m9, 16, b1, p3, Dict), get_dict(replan, Dict, true), planned(m9, 16), next_actions(next(m9, 16), Next),
    shown(Next, [started], Started), id(m9, 'b1/search/go', Go).
test('changes of a session that is closed are an error', throws(error(existence_error(session, m10), _))) :-
    under_way(m10), close_session(m10, _), changed(m10, 3, b1, p3, _).

:- end_tests(revised).

:- module(planner_hypotheses,
          [ suppose/2,                  % +Supposition, -Dict
            prospects/2                 % +Request, -Dict
          ]).

/** <module> What if: a session as it would be if something were otherwise

suppose/2 makes another session of a session: a choice is taken as told, a fact is another, more robots
may take part. It is planned like any session and guides nothing. prospects/2 lists what a program may
come to: its choices, and the facts that keep robots and branches from it.

These are entries of planner/hypotheses.py (see kb/prolog.py).
*/

:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(occurs), [sub_term/2]).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(durations)).
:- use_module(planner_golog(influence)).
:- use_module(planner_golog(obstacles)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(conditions)).
:- use_module(planner_golog(sessions)).
:- use_module(planner_golog(transition)).
:- use_module(planner_golog(travel)).

% ------------------------------------------------------------------------------------- suppositions

%!  suppose(+Supposition, -Dict) is det.
%
%   Supposition is supposition(Session, New, Changes): New is Session with all Changes, each one of
%
%     only(Id, Label)               at the choice Id, only Label is chosen
%     value(Property, Subject, V)   the property has this value
%     kind(Individual, Class)       the individual belongs to the class
%     team(N)                       at most N robots take part
%     deadline(Process, Old, New)   the process has New milliseconds instead of Old
%
%   What the planner looks up without a situation (classes, definitions) is changed in facts of its own,
%   which are those of the revision New.

suppose(supposition(Session, New, Changes), _{}) :-
    kept(Session, P0, S0),
    include(of_facts, Changes, Own),
    (   Own == []
    ->  S1 = S0
    ;   revision(S0, Revision),
        findall(Fact, moved(Revision, New, Fact), Facts0),
        foldl(in_facts(New), Own, Facts0, Facts),
        drop_facts(New, _),
        load_facts(Facts, _),
        with_revision(S0, New, S1)
    ),
    foldl(in_session, Changes, P0-S1, P-S),
    keep(New, P, S).

of_facts(kind(_, _)).
of_facts(deadline(_, _, _)).

%   A fact of Revision, as one of New.
moved(Revision, New, Fact) :-
    kb_facts:exported(Name/Arity),
    functor(Known, Name, Arity),
    arg(1, Known, Revision),
    kb_facts:Known,
    Known =.. [Name, _|Arguments],
    Fact =.. [Name, New|Arguments].

in_facts(New, Change, Facts0, Facts) :-
    (   Change = kind(X, Class)
    ->  Facts = [kind(New, X, Class)|Facts0]
    ;   Change = deadline(Process, Old, Later)
    ->  maplist(in_definition(Process, Old, Later), Facts0, Facts)
    ).

in_definition(Process, Old, New, Fact0, Fact) :-
    (   Fact0 = definition(R, Head, Frame, Body0), functor(Head, Process, _)
    ->  extended(Old, New, Body0, Body),
        Fact = definition(R, Head, Frame, Body)
    ;   Fact = Fact0
    ).

in_session(only(Id, Label), P-S0, P-S) :- set_data(only(Id), Label, S0, S).
in_session(value(Property, X, Value), P-S0, P-S) :- set_data(Property-X, Value, S0, S).
in_session(team(N), P-S0, P-S) :- with_limit(S0, N, S).
in_session(kind(_, _), P-S, P-S).
in_session(deadline(_, Old, New), P0-S, P-S) :- extended(Old, New, P0, P). % what has begun already

extended(_, _, Term, Term) :- \+ compound(Term), !.
extended(Old, New, deadline(Old, P0), deadline(New, P)) :- !, extended(Old, New, P0, P).
extended(Old, New, Term0, Term) :- mapargs(extended(Old, New), Term0, Term).

% ---------------------------------------------------------------------------------------- prospects

%!  prospects(+Request, -Dict) is det.
%
%   Request is prospects(Session, Below): all that the program may come to from where it is looked ahead
%   from, as far as choices are open (`only`). Facts in the way are told of the part below the choice
%   Below alone, if that is not `all`. Members of the answer, each in the order of the program:
%
%     choices    [Id, Kind, [Label, ...], [Name, ...]], Kind being individual, branch, or part (of an any-order)
%     claims     [Id, Resource]: of a step or composite process
%     deadlines  [Process, Milliseconds]
%     energies   [Robot, Energy, Power, Worked], in J, W and ms
%     obstacles  see planner_obstacles

prospects(prospects(Session, Below),
          _{choices: Choices, claims: Claims, deadlines: Deadlines, energies: Energies, obstacles: Obstacles}) :-
    ahead_of(Session, P, S),
    called(P, S, Names),
    ( Below == all -> Inside = true ; Inside = false ),
    findall(Item, met(P, in(S, Names, Session, Below, Inside), Item), Items0),
    list_to_set(Items0, Items),
    findall([Id, Kind, Labels, Told], member(option(Id, Kind, Labels, Told), Items), Choices),
    findall([Id, R], member(claim(Id, R), Items), Claims),
    findall([Process, Ms], member(deadline(Process, Ms), Items), Deadlines),
    findall([R, E, W, Done], ( member_of('Robot', R, S), energy(R, S, E, W, Done) ), Energies),
    findall(Row, ( member(obstacle(O), Items), row(O, S, Row) ), Obstacles).

energy(Robot, S, Energy, Power, Done) :-
    work_limit(Robot, _, S),
    fluent_value(energy_J, Robot, Energy, S),
    fluent_value(power_W, Robot, Power, S),
    worked(Robot, S, Done), !.

%   met(+Program, +In, -Item) is nondet. In is in(Situation, Names, Process, Below, Inside): Names are the
%   processes of the whole program, Process is the one that Program belongs to, Inside whether it is below Below.
met([P|Ps], In, Item) :- member(Q, [P|Ps]), met(Q, In, Item).
met(conc(Ps), In, Item) :- member(P, Ps), met(P, In, Item).
met(pconc(Ps), In, Item) :- member(P, Ps), met(P, In, Item).
met(search(P), In, Item) :- met(P, In, Item).
met(deadline(Ms, _), in(_, _, Process, _, _), deadline(Process, Ms)).
met(deadline(_, P), In, Item) :- met(P, In, Item).
met(picked(_, _, P), In, Item) :- met(P, In, Item).
met(scope(_, _, P), In, Item) :- met(P, In, Item).
met(star(_, _, P), In, Item) :- met(P, In, Item).
met(star(_, _, P, _), In, Item) :- met(P, In, Item).
met(until(P, _), In, Item) :- met(P, In, Item).
met(while(_, P), In, Item) :- met(P, In, Item).
met(if(C, P, Q), In, Item) :-
    In = in(S, Names, _, _, _),
    ( lasting(C, [], Names, S) -> asked(C, S, Answer) ; Answer = unknown ),
    ( Answer \== no, met(P, In, Item) ; Answer \== yes, met(Q, In, Item) ).
met(test(C), In, obstacle(broken(Process, [], Lasting, Broken))) :-
    In = in(_, _, Process, _, true),
    breaks(C, In, Lasting, Broken).
met(interrupt(Frame, Step, Vs, C, P), In, Item) :- met(foreach(Frame, Step, Vs, C, _, P), In, Item).
met(foreach(Frame, Step, Vs, C, Inner, P), In, Item) :-
    In = in(S, _, _, _, _),
    catch(instances(Frame, Step, Vs, C, Inner-P, S, Turns), error(depends_on_sensing(_), _), fail),
    member(Turn, Turns),
    met(Turn, In, Item).
met(choice(Frame, Step, Ps), In, Item) :-
    step_id(Frame, Step, Id),
    length(Ps, N),
    numlist(1, N, Numbers),
    maplist(told_branch, Ps, Names),
    (   Item = option(Id, branch, Numbers, Names)
    ;   nth1(K, Ps, P), taken(Id, K, In, In1), met(P, In1, Item)
    ).
met(any_order(Frame, Step, Ps), In, Item) :-
    length(Ps, N),
    numlist(1, N, Numbers),
    maplist(told_branch, Ps, Names),
    (   member(K, Numbers), atomic_list_concat([Frame, Step, K], /, Id), Item = option(Id, part, Numbers, Names)
    ;   member(P, Ps), met(P, In, Item)
    ).
met(any_order(_, _, Parts, _), In, Item) :- member(_-P, Parts), met(P, In, Item).
met(pick(Frame, Step, V, Class, P), In, Item) :-
    In = in(S, _, Process, _, Inside),
    step_id(Frame, Step, Id),
    findall(X, member_of(Class, X, S), Xs),
    (   Item = option(Id, individual, Xs, Xs)
    ;   Xs == [], Inside == true, Item = obstacle(nobody(Process, Class))
    ;   member(X, Xs), Inside == true, known(excluded(Id, X), true, S), Item = obstacle(failed(Process, X, Id))
    ;   member(X, Xs), taken(Id, X, In, In1), copy_term(V-P, X-Bound), met(Bound, In1, Item)
    ).
met(call(Frame, Step, Head0), In, Item) :-
    In = in(S, Names, _, Below, Inside),
    bound_head(Head0, S, Head),
    step_id(Frame, Step, Id),
    functor(Head, Name, _),
    (   claims_of(Head, Resources, S), member(R, Resources), Item = claim(Id, R)
    ;   Inside == true, obstacle(Head, in(S, Names, Name, Below, Inside), O), Item = obstacle(O)
    ;   \+ one_step(Head, _, S),
        \+ once_more(Name, In),
        expansion(Id, Head, S, Body),
        met(Body, in(S, Names, Name, Below, Inside), Item)
    ).

%   What performs itself is looked into once.
once_more(Name, in(S, _, Process, _, _)) :-
    revision(S, Revision),
    recursive(Revision, Name),
    recursive(Revision, Process), !.

taken(Id, Label, in(S, Names, Process, Below, Inside0), in(S, Names, Process, Below, Inside)) :-
    \+ excluded(Id, Label, S),
    ( Id == Below -> Inside = true ; Inside = Inside0 ).

%   A branch is called by the first process in it.
told_branch(P, Name) :-
    (   sub_term(T, P), nonvar(T), T = call(_, _, Head), nonvar(Head)
    ->  functor(Head, Name, _)
    ;   Name = nothing
    ).
